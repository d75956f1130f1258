from gen import *
D='/work/shared/data/turbine/'
tr=json.load(open(D+'truth.json'))
rows=list(csv.DictReader(open(D+'record.csv')))
k=np.array(tr['stiffness_n_m']); c=np.array(tr['damping_n_s_m'])
k2,c2=k.copy(),c.copy()
k2[1]*=tr['after_event']['stiffness_factor']; c2[1]*=tr['after_event']['damping_factor']
seal=tr['effect_parameters']['seal']
E=[];F=[];days=[];chi=[]
for r in rows:
    d=int(float(r['time_d'])); U=tr['unbalance_g_mm_deg'][d]
    u=np.array([U[0]*1e-6*np.exp(1j*np.radians(U[1])),U[2]*1e-6*np.exp(1j*np.radians(U[3]))])
    Y=response(float(r['speed_rpm']),*( (k,c,None) if d<125 else (k2,c2,seal)),u)
    y=np.array([complex(float(r[p['name']+'_cos_um'] or 'nan'),-float(r[p['name']+'_sin_um'] or 'nan')) for p in T['probe']])
    dlt=Y*1e6-y; e=np.nansum(abs(dlt.real)+abs(dlt.imag)); f=np.nansum(abs(y.real)+abs(y.imag))
    s=0.02*abs(Y)*1e6+0.03
    chi.append((np.nansum((dlt.real/s)**2+(dlt.imag/s)**2))/8)
    E.append(e);F.append(f);days.append(d)
E=np.array(E);F=np.array(F);days=np.array(days);chi=np.array(chi)
for m,nm in ((days<125,'before'),(days>=125,'after')):
    print(nm,m.sum(),'e',E[m].mean(),'f',F[m].mean(),'ratio',(E[m]/F[m]).mean(),'chi2',np.nanmean(chi[m]), 'max',E[m].max())
print('missing days',sorted(set(range(460))-set(days)))
U=np.array(tr['unbalance_g_mm_deg']); print(np.diff(U,axis=0).std(0), U[::40])
