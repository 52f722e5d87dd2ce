"""The language of robot skills: Bozhinoski and others, "A Modeling Tool for Reconfigurable Skills in ROS", section II.

``language`` turns a text into a ``skill_model``; ``reading`` does so for a file and all that it imports. ``checks`` are
functions over the model, a file for each subject. ``meaning`` is what a model comes to: states, rest, parameters.
``generators`` write the files for system_modes, for observers and for ontologies. ``library`` has skills that others
import.
"""
