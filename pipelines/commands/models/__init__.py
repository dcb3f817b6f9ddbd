"""Commands on a trained model: what it is worth, and what it dreams."""
