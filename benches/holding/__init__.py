"""Does a number predict what a hand holds? `grasps` makes hands' grasps, `measure` rates and shakes them.

`agreement` compares both by areas under ROC curves and rank correlations.
"""
