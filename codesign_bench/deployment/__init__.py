"""Policies on a simulated robot arm: a simulated version of the paper's evaluation on a real robot.

`task/robot.py` defines a simulator with an arm, `conditions.py` the differences from training, `rollout.py` plays one
trial, `protocol.py` lists the paper's trials, `deploy.py` runs and writes trials, `pictures.py` draws them, `tables.py`
reads their tables. See docs/deployment.md.
"""
