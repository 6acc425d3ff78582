"""What several methods share: networks, advantages, rollouts of whole episodes, PPO for two phases, CMA-ES."""
