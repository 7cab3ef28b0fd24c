"""SIRENs in torch: their value and gradient, their losses, their optimisation, and how levels nest."""
