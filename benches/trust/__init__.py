"""Families of grasps that practice is full of, each beside an independent answer."""
