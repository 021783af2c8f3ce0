# coding: utf-7


class Planner:
    pass
