"""Small equivalents of trees of others, and what BehaviorTree.CPP makes of them."""
