"""Forecast: predicts each option's utility from what the components' classes say they would give, and takes the best.

``planner`` is the component, ``outlook`` what an option would bring, ``expressions`` the language of utilities.
"""
