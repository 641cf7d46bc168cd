"""Pictures and pages of what the layers below know."""
