"""What the words after ``glowtree`` do."""
