"""Which findings of a study do results support? A study lists its claims; see docs/claims.md.

`claim.py` says what a claim and its rule are, `finding.py` what a rule finds, `evidence.py` what claims are judged on,
`verify.py` judges them and writes the table. Each other module holds rules of one kind.
"""
