"""Which of the paper's findings do results support? One claim, one entry in `paper.py`; see docs/claims.md.

`claim.py` says what a claim, its rule and its finding are, `evidence.py` what they are judged on, `rules.py` holds the
kinds of rules, `paper.py` the paper's claims, `verify.py` judges them and writes the table.
"""
