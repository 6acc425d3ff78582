"""Play finished policies and scripts: evaluation, pictures, design sensitivity, starts around the region, timing."""
