"""The steps of the layout, on boxes in nested groups: from ranks to the curves of edges."""
