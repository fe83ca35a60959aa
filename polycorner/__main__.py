"""``python -m polycorner`` is the command ``polycorner``."""

from polycorner.cli.main import main

if __name__ == "__main__":
    main()
