"""Learned Co-Wizard: one network that writes a working memory of the talk, and chooses commands and remarks.

Rules parse the words, plan the route, answer questions from the memory (`policies.knowledge`), and word the
remarks. `memory` holds its memory, `features` its inputs, `remarks` its possible remarks, `network` the network,
`teacher` the scripted Co-Wizard whose decisions it imitates, `demonstrations` and `fitting` its training, and `policy`
the player; `learned_role` has the code shared with the participant.
"""
