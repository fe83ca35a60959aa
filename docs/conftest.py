"""Pages are tested for their doctests; what the site is built with, and what it makes, is not."""

collect_ignore = ["conf.py", "generated"]
