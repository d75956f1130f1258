"""Records of turbines with known truth, on ROSS finite elements. gen.py OUTROOT"""
import sys, json, math, csv, tomllib, os
import numpy as np
sys.path.insert(0, '/tmp/h/track/tests/reference')
import make_ross_reference as mr
T = tomllib.load(open('/work/shared/data/turbine/rotor.toml','rb'))
_cache = {}
def shaft():
    if 'x' not in _cache:
        t = json.loads(json.dumps(T)); 
        for b in t['bearing']:
            for k in ('stiffness_n_m','damping_n_s_m'):
                b[k] = {a: 0.0 for a in b[k]}
        nodes, rotor = mr.build(t)
        keep = [6*i+j for i in range(len(nodes)) for j in (0,1,3,4)]
        M, K, G = (A[np.ix_(keep, keep)] for A in (rotor.M(1.0), rotor.K(1.0), rotor.G()))
        _cache['x'] = nodes, np.array(M), np.array(K), np.array(G)
    return _cache['x']
def response(rpm, k, c, seal, u):
    """k,c 2x2 [bearing][axis]; u complex kg m per plane; phasors of probes m"""
    nodes, M, K, G = shaft(); W = rpm*math.pi/30
    Z = K - W*W*M + 1j*W*W*G
    Z = Z.astype(complex)
    def add(z, S):
        n = mr.node(nodes, z)
        for a in (0,1):
            for b in (0,1): Z[4*n+a, 4*n+b] += S[a][b]
    for i,b in enumerate(T['bearing']):
        add(b['position_m'], [[k[i][0]+1j*W*c[i][0],0],[0,k[i][1]+1j*W*c[i][1]]])
    if seal:
        d = T['disk'][int(seal['disk'])]['position_m']
        s = seal['k']+1j*W*seal['c']; q = seal['q']
        add(d, [[s, q],[-q, s]])
    F = np.zeros((len(Z),2), complex)
    for j,p in enumerate(T['plane']):
        n = mr.node(nodes, p['position_m']); F[4*n,j]=W*W; F[4*n+1,j]=-1j*W*W
    q = np.linalg.solve(Z, F) @ u
    Y=[]
    for p in T['probe']:
        n = mr.node(nodes, p['position_m']); a = math.radians(p['angle_deg'])
        Y.append(q[4*n]*math.cos(a)+q[4*n+1]*math.sin(a))
    return np.array(Y)
