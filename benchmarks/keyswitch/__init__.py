"""Key switches: 119 measured force curves on which the door networks are tested without ratings."""
