"""Results that people share: packing them into archives, comparing them, and the leaderboard made of them."""
