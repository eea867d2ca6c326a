"""Learned participant: one network that chooses the next errand, and the content and time of its remarks to the car.

`memory` and `records` hold its state, `features` its inputs, `remarks` its possible remarks, `network` the network,
`teacher` the scripted participant whose decisions it imitates, `demonstrations`, `fitting` and `training` the training,
and `policy` the player.
"""
