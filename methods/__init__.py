"""One file per method.

| file | method | source |
| --- | --- | --- |
| `gnn_ppo` | graph-network designer and controller, trained together by PPO | the paper's own framework |
| `shared_arch` | one multilayer perceptron with a design and a control head | the paper's ablation |
| `cma_rl` | CMA-ES over one design outside, PPO for its controller inside | the paper's bi-level baseline |
| `hwasp_minimal` | one design, trained by policy gradient with the controller | Chen et al. 2020, Ha 2018 |
| `cma_es` | CMA-ES over one design and one open-loop control sequence | the paper's single-trajectory baseline |
"""

ORDER = ("gnn_ppo", "shared_arch", "cma_rl", "hwasp_minimal", "cma_es")
"""The paper's five methods in the paper's order: the methods of `--method all`."""
