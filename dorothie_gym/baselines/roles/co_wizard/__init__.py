"""Learned Co-Wizard: one network that writes a working memory of the talk, and chooses commands and remarks.

Rules read the words, plan the route, answer questions by what the memory knows (`policies.knowledge`), and word the
remarks. `memory` is what it remembers, `features` what it sees, `remarks` what it can say, `network` the network,
`teacher` the scripted Co-Wizard whose decisions it imitates, `demonstrations` and `fitting` its training, and `policy`
the player; `learned_role` has what it shares with the participant.
"""
