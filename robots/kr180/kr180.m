%Robot Kuka KR180
% Definition Links link ([alpha a theta d sigma])
clear L
L{1} = link([ pi/2 0.35 0 0.75 0], 'standard');
L{2} = link([ 0 0 0 1.25 0], 'standard');
L{3} = link([ pi/2 1.6 0 0 0], 'standard');
L{4} = link([ 0 0 0 2.6 0], 'standard');
% Mass of segments of the robot L{1}.m
L{2}.m =150; L{3}.m =100; L{4}.m =50;
% The position of the center of mass of the segment relative to its coordinate system [xyz]
L{1}.r = [ 0 0 0.3];
L{2}.r = [ -0.1 -0.1 0];
L{3}.r = [ 0.1 0.05 0];
L{4}.r = [ 0 0 0.18];
%Tensor segments inertia elements to its center mass
L{1}.I = [ 0 0.35 0 0 0 0];
L{2}.I = [ .13 .524 .539 0 0 0];
L{3}.I = [ .066 .086 .0125 0 0 0];
L{4}.I = [ 1.8e-3 1.3e-3 1.8e-3 0 0 0];
% Inertia of the segment
L{1}.Jm = 200e-6;
L{2}.Jm = 200e-6;
L{3}.Jm = 200e-6;
L{4}.Jm = 33e-6;
% Transmission ratio crank/segment
L{1}.G = -62.6111;
L{2}.G = 107.815;
L{3}.G = -53.7063;
L{4}.G = 76.0364;
%Viscous friction
L{1}.B = 1.48e-3;
L{2}.B = .817e-3;
L{3}.B = 1.38e-3;
L{4}.B = 71.2e-6;
% Coulomb friction
L{1}.Tc = [ .395 -.435];
L{2}.Tc = [ .126 -.071];
L{3}.Tc = [ .132 -.105];
L{4}.Tc = [ 11.2e-3 -16.9e-3];
kuka = robot(L, 'KR180', 'KUKA Robotics', 'params of 8/95'); kuka.name = 'KR180';
kuka.manuf = 'KUKA Robotics';
