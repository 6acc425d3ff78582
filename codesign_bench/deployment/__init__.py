"""Policies on a simulated robot arm: the paper's evaluation on a real robot, as far as a simulator can stand for it.

`task/robot.py` says what a simulator with an arm offers, `conditions.py` what may differ from training, `rollout.py`
plays one trial, `protocol.py` says which trials the paper ran, `deploy.py` runs trials and writes them, `pictures.py`
draws one, `tables.py` reads them back. See docs/deployment.md.
"""
