"""Doctests of the pages; the configuration of the site and its output are not tested."""

collect_ignore = ["conf.py", "generated"]
