"""Learned participant: one network that chooses the next errand, and the content and time of its remarks to the car.

`memory` and `records` are what it keeps of the session, `features` what it sees, `remarks` what it can say, `network`
the network, `teacher` the scripted participant whose decisions it imitates, `demonstrations` and `fitting` its
training, and `policy` the player; `learned_role` has what it shares with the Co-Wizard.
"""
