L{1} = link([pi/2 0.4 0 0.7 0], 'standard');
L{1}.m = 17.4; L{1}.r = [1 2 3]; L{1}.I = [1 2 3 4 5 6]; L{1}.Jm = 2e-4; L{1}.G = -60; L{1}.Tc = [0.4 -0.4];
L{2} = link([0 0.4 1 0 1], 'standard'); L{2}.qlim = [-1 2];
kuka = robot(L, 'r', 'm', 'c');
