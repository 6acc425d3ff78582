"""Claims of a study and the rules that judge them on results; see docs/claims.md.

`claim.py` defines claim and rule, `finding.py` a rule's finding, `evidence.py` the data, `statistics.py` what several
rules share. `judging.py` judges claims, `page.py` puts them into words, and `verify.py` is the command. The other
modules have the kinds of rules.
"""
