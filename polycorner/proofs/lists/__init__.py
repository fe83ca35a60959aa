"""Complete lists of stationary points and corners, by branch and bound with a proof."""
