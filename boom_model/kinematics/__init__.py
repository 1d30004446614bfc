"""Kinematics of the boom: frames, tip pose and Jacobian, inverse kinematics and reach.

The inverse kinematics of a tip position and a pitch leaves one redundant joint (self-motion). A
constraint determines it.
"""
