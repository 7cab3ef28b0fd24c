"""The gallery: trained models that `mplicits view NAME` finds by name. README.md has credits and commands."""
