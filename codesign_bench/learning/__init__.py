"""Building blocks of the methods: networks, advantages, rollouts of whole episodes, two-phase PPO, CMA-ES."""
