"""Does a number predict what a hand holds?

`objects` draws meshes, `grasps` makes grasps of them, and `measure` rates and pushes these. `agreement` compares
both by areas under ROC curves and rank correlations.
"""
