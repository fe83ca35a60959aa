"""The compiled steps of first-order motion."""
