"""A torso with a waist about the vertical, which hides where its trunk's weight lies."""

WAIST = """<robot name="torso"><link name="base"/>
  <link name="trunk"><inertial><origin xyz="0.05 0.02 0.2"/><mass value="6"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.05"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <joint name="waist" type="revolute"><parent link="base"/><child link="trunk"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="4" effort="99"/></joint>
  <joint name="shoulder" type="revolute"><parent link="trunk"/><child link="arm"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="4" effort="99"/></joint></robot>"""
