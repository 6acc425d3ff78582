"""Record what torch-geometric's GraphConv computes, for the tests to compare with: run this file, with that package.

It writes `tests/data/graph_convolution.json`: weights, inputs and outputs of one layer on a small graph.
"""

from __future__ import annotations

import json
from pathlib import Path

import torch
import torch_geometric
from torch_geometric.nn import GraphConv

RECORD = Path(__file__).resolve().parent.parent / "data" / "graph_convolution.json"
EDGES = ((0, 1), (1, 2), (1, 3))
NODES, INPUTS, OUTPUTS = 4, 3, 2


def main() -> None:
    """Make the layer, apply it and write everything down."""
    torch.manual_seed(0)
    layer = GraphConv(INPUTS, OUTPUTS, aggr="add")
    x = torch.randn(NODES, INPUTS)
    both_ways = torch.tensor([*EDGES, *((j, i) for i, j in EDGES)]).t()
    record = {
        "how": "python tests/learning/make_graph_convolution.py",
        "versions": {"torch": torch.__version__, "torch_geometric": torch_geometric.__version__},
        "layer": "GraphConv(3, 2, aggr='add')",
        "edges": EDGES,
        "own_weight": layer.lin_root.weight.tolist(),
        "neighbours_weight": layer.lin_rel.weight.tolist(),
        "bias": layer.lin_rel.bias.tolist(),
        "x": x.tolist(),
        "output": layer(x, both_ways).tolist(),
    }
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
