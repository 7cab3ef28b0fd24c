"""What `import mplicits` offers: `Field`, a model as programs use it, and the functions that make one."""
