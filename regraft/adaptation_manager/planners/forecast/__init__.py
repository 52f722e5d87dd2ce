"""Forecast: predicts each option's utility from the estimates of the components' classes, and takes the best.

``forecast_planner`` is the component, ``forecast`` what an option would bring.
"""
