"""Subcommands about dumbbells."""
