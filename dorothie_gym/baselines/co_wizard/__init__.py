"""Learned Co-Wizard: one network that writes a working memory of the dialogue, and chooses commands and remarks.

Rules read the words, plan the route, answer questions from evidence, and word the remarks.

`memory` holds its memory, `hearing` its inputs from speech, `features` its other inputs, `remarks` its possible
remarks, `network` the network, `teacher` the scripted Co-Wizard whose decisions it imitates, `demonstrations`,
`fitting` and `training` the training, and `policy` the player.
"""
