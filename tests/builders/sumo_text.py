"""What SUMO writes of a small run: floating car data, routes and a network."""

from __future__ import annotations

FCD = """<?xml version="1.0" encoding="UTF-8"?>
<fcd-export>
 <timestep time="0.00">
  <vehicle id="a" x="110.0" y="50.0" z="1.5" angle="90.0" type="long" speed="10.0" lane="e_0" slope="0.0"/>
  <person id="w" x="20.0" y="30.0" angle="0.0" type="DEFAULT_PEDTYPE" speed="1.3" edge="e"/>
 </timestep>
 <timestep time="0.20">
  <vehicle id="b" x="10.0" y="20.0" z="0.0" angle="350.0" type="unheard" speed="5.0" lane="e_0" slope="0.0"/>
  <vehicle id="a" x="112.0" y="50.0" z="1.5" angle="90.0" type="long" speed="10.0" lane="e_0" slope="0.0"/>
 </timestep>
 <timestep time="0.40">
  <vehicle id="b" x="10.0" y="21.0" z="0.0" angle="10.0" type="unheard" speed="5.0" lane="e_0" slope="0.0"/>
 </timestep>
</fcd-export>
"""
ROUTES = """<routes>
 <vTypeDistribution id="mix"><vType id="long" vClass="bus" length="10" width="2.5" height="3"/></vTypeDistribution>
 <vType id="default_truck" vClass="truck"/>
 <vType id="van_by_shape" guiShape="delivery" length="6"/>
 <vType id="plain"/>
</routes>
"""
NET = '<net><location netOffset="270.79,-200.32" convBoundary="0,0,1,1"/><edge id="1"/></net>'
