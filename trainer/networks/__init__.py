"""SIRENs in torch: value and gradient, losses, optimiser, weights on a grid."""
