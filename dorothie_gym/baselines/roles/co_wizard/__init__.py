"""Learned Co-Wizard: one network that writes a working memory of the talk, and chooses commands and remarks.

Rules read the words, plan the route, answer questions from evidence, and word the remarks.

`memory` is what it remembers, `hearing` what it hears, `features` what it sees, `remarks` what it can say, `network`
the network, `teacher` the scripted Co-Wizard whose decisions it imitates, `demonstrations`, `fitting` and `training`
the training, and `policy` the player.
"""
