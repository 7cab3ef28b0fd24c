"""The verb `gallery`: a static web site of models. It joins the targets of bake to one folder of pages."""
