"""Common parts of the learned Co-Wizard and the learned participant.

A role fills `training.LearnedRole`: its files and network, examples, loss, and how lessons are made. `hearing`,
`decision` and `encoding` turn observations into inputs, `network` has layers, `remark_forms` the forms of remarks,
`policy` the player, `practice`, `examples`, `supervised` and `rounds` the parts of a training, `files` the models.
"""
