"""Work in pieces that do not depend on each other: on this machine or many, stopped and taken up again."""
