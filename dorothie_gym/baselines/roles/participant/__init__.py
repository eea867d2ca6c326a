"""Learned participant: one network that chooses the next errand, and the content and time of its remarks to the car.

`memory` and `records` hold its memory, `features` its inputs, `remarks` its possible remarks, `network`
the network, `teacher` the scripted participant whose decisions it imitates, `demonstrations` and `fitting` its
training, and `policy` the player; `learned_role` has the code shared with the Co-Wizard.
"""
