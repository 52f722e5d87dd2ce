"""Forecast: predicts each option's utility from what the components' classes say they would give, and takes the best.

``forecast_planner`` is the component, ``forecast`` what an option would bring.
"""
