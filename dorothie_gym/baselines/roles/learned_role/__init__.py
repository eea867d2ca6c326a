"""Common parts of the learned Co-Wizard and the learned participant.

A role fills `training.LearnedRole`: its files and network, examples, loss, and the functions that make lessons.
`utterance_inputs`, `decision` and `encoding` turn observations into inputs, `network` has layers, `remark_forms` the
forms of remarks, `policy` the player, and `model_files` the files of models. The parts of a training are `dagger`,
`dagger_sessions`, `examples` and `supervised`.
"""
