"""SIRENs in torch: values and gradients, losses, optimization, and nested levels."""
