"""Light as points receive it: gathered from all that they see, and what that says of the error of a solution."""
