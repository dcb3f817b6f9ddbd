"""A trained model on clips of a release: measured, and drawn."""
