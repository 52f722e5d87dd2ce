"""The metacontroller of MROS2: skills with realizations, chosen by a knowledge base.

``skills`` is the language in which skills are described, its checks and what is generated from it.
``knowledge`` is the base of designs with its rules. ``reasoning`` analyses objectives and selects designs for them.
"""
