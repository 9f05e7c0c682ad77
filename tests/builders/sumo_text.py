"""What SUMO writes of a small run: floating car data in its forms, routes and a network."""

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
NATIVE_CSV = """\
timestep_time;vehicle_id;vehicle_x;vehicle_y;vehicle_z;vehicle_angle;vehicle_type;vehicle_speed;vehicle_lane;vehicle_edge
0.00;a;110.0;50.0;1.5;90.0;long;10.0;e_0;
0.00;w;20.0;30.0;;0.0;DEFAULT_PEDTYPE;1.3;;e
0.20;b;10.0;20.0;0.0;350.0;unheard;5.0;e_0;
0.20;a;112.0;50.0;1.5;90.0;long;10.0;e_0;
0.40;b;10.0;21.0;0.0;10.0;unheard;5.0;e_0;
"""
CONVERTED_CSV = """\
timestep_time,vehicle_angle,vehicle_id,vehicle_lane,vehicle_speed,vehicle_type,vehicle_x,vehicle_y,vehicle_z,\
person_angle,person_edge,person_id,person_speed,person_type,person_x,person_y
0.00,90.0,a,e_0,10.0,long,110.0,50.0,1.5,,,,,,,
0.00,,,,,,,,,0.0,e,w,1.3,DEFAULT_PEDTYPE,20.0,30.0
0.20,350.0,b,e_0,5.0,unheard,10.0,20.0,0.0,,,,,,,
0.20,90.0,a,e_0,10.0,long,112.0,50.0,1.5,,,,,,,
0.40,10.0,b,e_0,5.0,unheard,10.0,21.0,0.0,,,,,,,
"""
ROUTES = """<routes>
 <vTypeDistribution id="mix"><vType id="long" vClass="bus" length="10" width="2.5" height="3"/></vTypeDistribution>
 <vType id="default_truck" vClass="truck"/>
 <vType id="van_by_shape" guiShape="delivery" length="6"/>
 <vType id="plain"/>
</routes>
"""
NET = '<net><location netOffset="270.79,-200.32" convBoundary="0,0,1,1"/><edge id="1"/></net>'
