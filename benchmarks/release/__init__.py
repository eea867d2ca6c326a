"""Figures of a release: measured by steps at one commit, kept in one file, and quoted by the pages.

`steps.STEPS` measure, `docs/figures.json` keeps the figures with commit and command (`figures`), and `quotes.toml` says
where README and docs state them (`quotes`).
"""
