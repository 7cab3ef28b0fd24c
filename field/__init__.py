"""A model's field in NumPy: values, rays, cells, bounds, posters. Every target is tested against `interpret.py`."""
