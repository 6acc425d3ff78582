"""Claims of a study and the rules that judge them on results; see docs/claims.md.

`claim.py` defines claim and rule, `finding.py` a rule's finding, `evidence.py` the data, `statistics.py` what several
rules share. The other modules have the kinds of rules, and `verify.py` judges claims and writes the table.
"""
