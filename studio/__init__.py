"""The studio: a web page that trains models."""
