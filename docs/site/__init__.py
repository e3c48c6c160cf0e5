"""What turns the pages of this folder into the documentation site; see ``mkdocs.yml``."""
