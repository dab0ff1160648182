"""Key switches: 119 real force curves that the door networks are proven on, without ratings."""
