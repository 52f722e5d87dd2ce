"""The component that runs missions written as behaviour trees."""
