"""``python -m paper_checks``: run every check and print what was found."""

import textwrap

from paper_checks import CLAIMS


def main() -> None:
    for claim in CLAIMS:
        finding = claim.check()
        print(f"{claim.id:<4} {finding.outcome.value:<30} {claim.statement} [{claim.section}]")
        print(textwrap.indent(textwrap.fill(finding.evidence, 94), " " * 5))


if __name__ == "__main__":
    main()
