"""Compare numbers that are said of grasps with what a simulated hand holds.

`objects` draws meshes, `grasps` makes grasps of them, and `measure` rates and pushes these. `agreement` has
areas under ROC curves and rank correlations.
"""
