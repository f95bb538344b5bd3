"""Certified grasp quality, contact planning and force distribution for multifingered grasps."""
