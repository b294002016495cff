(* The theorem: a configuration is live for everyone iff no full places wait for one another in a circle and (S) holds.

   Live for everyone: it belongs to a set of configurations from each of which moves lead each vehicle on, and back into
   the set. So every vehicle can move again and again, for ever. *)
Require Import Model Chain Crowd Service Way Ends.
Require Push.

(* moves one after another, and from which places *)
Inductive run `{R : roads} : config -> list nat -> config -> Prop :=
| nothing D : run D [] D
| more p D E l F : move p D E -> run E l F -> run D (p :: l) F.

Definition times (p : nat) (l : list nat) := count_occ Nat.eq_dec l p.

(* from each configuration of L each vehicle can move, and all come back into L. The vehicle at s has the vehicles of a
   before it in its line: it has moved iff its place has given away more than these (`its_turn`). *)
Definition keeps `{R : roads} (L : config -> Prop) := forall D p a s b, L D -> D p = a ++ s :: b ->
  exists l E, run D l E /\ L E /\ length a < times p l.
Definition live `{R : roads} (D : config) := exists L, keeps L /\ L D.

(* following heads over full places one comes back to where one began *)
Definition circle `{R : roads} (D : config) := exists p n, way D p (S n) p.

(* a relation on finitely many things contains a function *)
Lemma table {A B} (eq : forall a b : A, {a = b} + {a <> b}) (b0 : B) (Rel : A -> B -> Prop) l :
  (forall a, In a l -> exists b, Rel a b) -> exists f, forall a, In a l -> Rel a (f a).
Proof.
  induction l as [|a l IH]; intro H; [exists (fun _ => b0); intros a []|].
  destruct IH as [f Hf]; [intros; apply H; right; auto|]. destruct (H a) as [b Hb]; [left; auto|].
  exists (fun x => if eq x a then b else f x). intros x [<-|I]; destruct (eq _ _); subst; auto; contradiction.
Qed.

Section Runs.
Context `{R : roads}.

Lemma run_app D l E m F : run D l E -> run E m F -> run D (l ++ m) F.
Proof. induction 1; simpl; auto. intro. eapply more; eauto. Qed.

Lemma run_possible D l E : run D l E -> possible D -> possible E.
Proof. induction 1; auto. intro. apply IHrun. eapply move_possible; eauto. Qed.

Lemma times_app p l m : times p (l ++ m) = times p l + times p m.
Proof. apply count_occ_app. Qed.

Lemma line_after q D E p : possible D -> move q D E -> p <> q -> E p = D p \/ exists t, E p = D p ++ [t].
Proof.
  intros P (s & line & Dq & Room & Eq & Et & Rest) N.
  destruct (Nat.eq_dec p (place (next s))) as [->|]; eauto.
Qed.

Lemma head_goes s line D E : possible D -> move (place s) D E -> D (place s) = s :: line ->
  E (place s) = line /\ E (place (next s)) = D (place (next s)) ++ [next s].
Proof. intros P (t & m & Dp & _ & Ep & Et & _) H. rewrite H in Dp. injection Dp as <- <-. auto. Qed.

Lemma stands_here D p a s b : possible D -> D p = a ++ s :: b -> place s = p.
Proof. intros P E. apply (P p). rewrite E. apply in_or_app. right. left. auto. Qed.

(* first in, first out *)
Lemma first_out D l E p : run D l E -> possible D -> times p l <= length (D p) ->
  exists new, E p = skipn (times p l) (D p) ++ new.
Proof.
  induction 1 as [D|q D E l F M Rn IH]; intros P L; [exists []; rewrite app_nil_r; auto|].
  assert (PE := move_possible q D E P M). unfold times in *. simpl in *. destruct (Nat.eq_dec q p) as [->|N].
  - destruct (D p) as [|s line] eqn:Dp; [simpl in L; lia|].
    assert (Ps : place s = p) by (apply (stands_here D p [] s line P); auto). rewrite <- Ps in M, Dp.
    destruct (head_goes s line D E P M Dp) as [Ep _]. rewrite Ps in Ep. simpl. rewrite <- Ep.
    apply IH; auto. rewrite Ep. simpl in L. lia.
  - destruct (line_after q D E p P M) as [Ep|[t Ep]]; auto; destruct (IH PE) as [new H]; rewrite ?Ep, ?app_length in *; simpl; try lia.
    + exists new. auto.
    + exists (t :: new). rewrite H, skipn_app. replace (count_occ Nat.eq_dec l p - length (D p)) with 0 by lia.
      simpl. rewrite <- app_assoc. auto.
Qed.

(* the vehicle at s moves, as the head of its place, somewhere in the run *)
Definition passes D l E s := exists l1 F G l2,
  l = l1 ++ place s :: l2 /\ run D l1 F /\ head F (place s) = Some s /\ move (place s) F G /\ run G l2 E.

Lemma passes_later q D E l F s : move q D E -> passes E l F s -> passes D (q :: l) F s.
Proof.
  intros M (l1 & G & K & l2 & -> & A & B). exists (q :: l1), G, K, l2. split; auto. split; auto. eapply more; eauto.
Qed.

Lemma passes_left D l E m F s : run D l E -> passes E m F s -> passes D (l ++ m) F s.
Proof. induction 1; simpl; auto. intro. eapply passes_later; eauto. Qed.

Lemma passes_right D l E m F s : run E m F -> passes D l E s -> passes D (l ++ m) F s.
Proof.
  intros Rm (l1 & G & K & l2 & -> & A & B & C & H). exists l1, G, K, (l2 ++ m). rewrite <- app_assoc.
  repeat (split; auto). eapply run_app; eauto.
Qed.

Lemma far_far j k (s : spot) : far j (far k s) = far (k + j) s.
Proof. revert s. induction k; intro s; simpl; auto. Qed.

(* a vehicle drives along its loop, spot by spot *)
Lemma along D l E : run D l E -> possible D -> forall p a s b, D p = a ++ s :: b -> exists j,
  In (far j s) (E (place (far j s))) /\ (forall i, i < j -> passes D l E (far i s)) /\ (length a < times p l -> 0 < j).
Proof.
  induction 1 as [D|q D E l F M Rn IH]; intros P p a s b Dp.
  - exists 0. simpl. split; [|split; intros; lia]. rewrite (stands_here D p a s b P Dp), Dp. apply in_or_app. right. left. auto.
  - assert (PE := move_possible q D E P M). assert (Ps := stands_here D p a s b P Dp).
    assert (Later : forall a b, E p = a ++ s :: b -> (length a < times p l) = (length a < times p l) -> exists j,
      In (far j s) (F (place (far j s))) /\ (forall i, i < j -> passes D (q :: l) F (far i s)) /\ (length a < times p l -> 0 < j)).
    { intros a' b' Ep _. destruct (IH PE p a' s b' Ep) as (j & I & B & C). exists j. split; auto. split; auto.
      intros i L. eapply passes_later; eauto. }
    destruct (Nat.eq_dec q p) as [->|N].
    + destruct a as [|c a]; simpl in Dp.
      * rewrite <- Ps in M, Dp. destruct (head_goes s b D E P M Dp) as [_ Et].
        destruct (IH PE (place (next s)) (D (place (next s))) (next s) []) as (j & I & B & _); auto.
        exists (S j). split; auto. split; [|lia]. intros [|i] L; simpl.
        { exists [], D, E, l. rewrite Ps. repeat split; auto; [constructor| |rewrite <- Ps; auto].
          unfold head. rewrite <- Ps, Dp. auto. }
        rewrite Ps in M. eapply passes_later; eauto. apply B. lia.
      * assert (Ep : E p = a ++ s :: b).
        { destruct M as (t & line & Dq & _ & Eq & _). rewrite Dp in Dq. injection Dq as _ <-. auto. }
        destruct (Later a b Ep eq_refl) as (j & I & B & C). exists j. split; auto. split; auto. intro L. apply C.
        unfold times in *. simpl in L. destruct (Nat.eq_dec p p); [lia|contradiction].
    + assert (Ep : exists b', E p = a ++ s :: b').
      { destruct (line_after q D E p P M) as [Ep|[t Ep]]; auto; rewrite Dp in Ep; [eauto|]. exists (b ++ [t]). rewrite Ep, <- app_assoc. auto. }
      destruct Ep as [b' Ep]. destruct (Later a b' Ep eq_refl) as (j & I & B & C). exists j. split; auto. split; auto. intro L.
      apply C. unfold times in *. simpl in L. destruct (Nat.eq_dec q p); [contradiction|auto].
Qed.

(* when its place has given away more than stood before a vehicle, the vehicle has moved *)
Theorem its_turn D l E p a s b : run D l E -> possible D -> D p = a ++ s :: b -> length a < times p l -> passes D l E s.
Proof.
  intros Rn P Dp L. destruct (along D l E Rn P p a s b Dp) as (j & _ & B & C). apply (B 0). auto.
Qed.

Lemma jam_lasts D l E C : run D l E -> jam C D -> jam C E /\ forall p, In p l -> ~ C p.
Proof.
  induction 1 as [D|q D E l F M Rn IH]; intro J; [split; auto; intros p []|].
  destruct (jam_stays C D q E J M) as (N & J2 & _). destruct (IH J2) as [J3 Out]. split; auto.
  intros p [<-|I]; auto.
Qed.

(* a jam is a circle *)
Lemma way_from D c i r : way D c i r -> forall k x, way D c (i + k) x -> way D r k x.
Proof.
  intro A. induction k as [|k IH]; intros x B.
  - rewrite Nat.add_0_r in B. rewrite (one_way D c i x r); auto. constructor.
  - rewrite Nat.add_succ_r in B. inversion B; subst. eapply onto; eauto.
Qed.

Lemma circle_jams D : circle D -> jammed D.
Proof.
  intros (p & n & W). assert (Fp : full D p) by (inversion W; auto).
  exists (fun r => full D r /\ exists k, k < S n /\ way D p k r). split.
  - exists p. split; auto. exists 0. split; [lia|constructor].
  - intros r (Fr & k & L & B). split; auto. destruct (goes_on D p (S n) p W k r L B) as (x & Wx & Fx).
    exists x. split; auto. split; auto. destruct (Nat.eq_dec k n) as [->|N].
    + exists 0. split; [lia|]. assert (x = p); [|subst; constructor].
      apply (one_way D p (S n)); auto. eapply onto; eauto.
    + exists (S k). split; [lia|]. eapply onto; eauto.
Qed.

Lemma jam_has_circle D places : (forall s, place s < places) -> possible D -> (forall p, 0 < slots p) -> jammed D -> circle D.
Proof.
  intros All P Pos (C & (c & Cc) & J).
  assert (Bound : forall r, C r -> r < places).
  { intros r Cr. destruct (J r Cr) as [F _]. unfold full in F. specialize (Pos r).
    destruct (D r) as [|s l] eqn:Dr; [simpl in F; lia|]. assert (place s = r) by (apply (P r); rewrite Dr; left; auto).
    subst r. apply All. }
  assert (H : forall n, exists l, length l = S n /\ (forall i, i <= n -> way D c i (nth i l 0) /\ C (nth i l 0))).
  { induction n as [|n (l & Len & H)].
    - exists [c]. split; auto. intros [|i] L; [|lia]. split; [constructor|auto].
    - destruct (H n) as [W Cn]; auto. destruct (J _ Cn) as [_ (q & Wq & Cq)]. destruct (J q Cq) as [Fq _].
      exists (l ++ [q]). split; [rewrite app_length; simpl; lia|]. intros i L. destruct (Nat.eq_dec i (S n)) as [->|N].
      + rewrite app_nth2 by lia. replace (S n - length l) with 0 by lia. simpl. split; auto. eapply onto; eauto.
      + rewrite app_nth1 by lia. apply H. lia. }
  destruct (H places) as (l & Len & Hl). apply NNPP. intro No. assert (ND : NoDup l).
  { apply (NoDup_nth l 0). assert (Less : forall i j, i < j -> j < length l -> nth i l 0 = nth j l 0 -> False).
    { intros i j L Lj E. destruct (Hl i) as [Wi _]; [lia|]. destruct (Hl j) as [Wj _]; [lia|]. apply No.
      exists (nth i l 0), (j - S i). apply (way_from D c i); auto. rewrite E. replace (i + S (j - S i)) with j by lia. auto. }
    intros i j Li Lj E. destruct (Nat.lt_trichotomy i j) as [L|[L|L]]; auto; exfalso; [apply (Less i j)|apply (Less j i)]; auto. }
  assert (I : incl l (seq 0 places)).
  { intros r Ir. apply (In_nth l r 0) in Ir. destruct Ir as (i & Li & <-). apply in_seq. split; [lia|].
    apply Bound. apply Hl. lia. }
  assert (X := NoDup_incl_length ND I). rewrite seq_length in X. lia.
Qed.
End Runs.

Section Everyone.
Context `{R : roads}.
Hypothesis wide : forall p, 2 <= slots p.
Variable places : nat.
Hypothesis all_places : forall s, place s < places.
Variable spots : list spot.
Hypothesis all_spots : forall s, In s spots.
Hypothesis spot_eq : forall s t : spot, {s = t} + {s <> t}.
Hypothesis closed : forall s, exists k, far (S k) s = s.

(* Necessary. *)
Section Necessary.
Variable L : config -> Prop.
Hypothesis goes_on_for_ever : keeps L.

Lemma no_jam D : L D -> ~ jammed D.
Proof.
  intros LD (C & (p & Cp) & J). destruct (J p Cp) as [F _]. unfold full in F. specialize (wide p).
  destruct (D p) as [|s b] eqn:Dp; [simpl in F; lia|].
  destruct (goes_on_for_ever D p [] s b LD Dp) as (l & E & Rn & _ & T).
  destruct (jam_lasts D l E C Rn) as [_ Out]; [split; eauto|]. apply (Out p); auto.
  apply (count_occ_In Nat.eq_dec). unfold times in T. simpl in T. lia.
Qed.

Lemma walks k : forall D p a s b, L D -> possible D -> D p = a ++ s :: b -> exists l E j,
  run D l E /\ L E /\ k <= j /\ In (far j s) (E (place (far j s))) /\ forall i, i < j -> passes D l E (far i s).
Proof.
  induction k as [|k IH]; intros D p a s b LD P Dp.
  - exists [], D, 0. split; [constructor|]. split; auto. split; auto. split; [|intros; lia].
    simpl. rewrite (stands_here D p a s b P Dp), Dp. apply in_or_app. right. left. auto.
  - destruct (IH D p a s b LD P Dp) as (l & E & j & Rn & LE & Le & I & B).
    destruct (le_lt_dec (S k) j) as [Ok|Lt]; [exists l, E, j; auto|].
    destruct (in_split _ _ I) as (a2 & b2 & Es). destruct (goes_on_for_ever E _ a2 _ b2 LE Es) as (m & F & Rm & LF & T).
    destruct (along E m F Rm (run_possible _ _ _ Rn P) _ a2 _ b2 Es) as (j2 & I2 & B2 & More).
    exists (l ++ m), F, (j + j2). specialize (More T). rewrite far_far in I2. split; [eapply run_app; eauto|].
    split; auto. split; [lia|]. split; auto. intros i Li. destruct (le_lt_dec j i) as [Ge|Less].
    + eapply passes_left; eauto. replace (far i s) with (far (i - j) (far j s)); [apply B2; lia|]. rewrite far_far. f_equal. lia.
    + eapply passes_right; eauto.
Qed.

(* a loop that leads out of Q and into it leads into it from outside, again and again *)
Lemma enters Q (s : spot) : crosses Q s -> exists i, ~ In (place (far i s)) Q /\ In (place (far (S i) s)) Q.
Proof.
  intros [[i I] [j O]]. destruct (closed s) as [k K].
  assert (Round : forall m, far (S k * m + i) s = far i s).
  { induction m as [|m IHm]; [rewrite Nat.mul_0_r; auto|]. replace (S k * S m + i) with (S k + (S k * m + i)) by lia.
    rewrite <- far_far, K. auto. }
  assert (H : forall d, In (place (far (j + d) s)) Q -> exists i, ~ In (place (far i s)) Q /\ In (place (far (S i) s)) Q).
  { induction d as [|d IHd]; intro Id; [rewrite Nat.add_0_r in Id; contradiction|].
    destruct (classic (In (place (far (j + d) s)) Q)) as [Y|N]; auto. exists (j + d). split; auto.
    rewrite Nat.add_succ_r in Id. auto. }
  apply (H (S k * j + i - j)). replace (j + (S k * j + i - j)) with (S k * j + i) by (simpl; lia). rewrite Round. auto.
Qed.

Lemma no_crowd D : L D -> possible D -> uncrowded D.
Proof.
  intros LD P Q f ND St In_ (x & s & I & Cr). apply NNPP. intro Too.
  destruct (enters Q s Cr) as (i & Out & Into). destruct (in_split _ _ I) as (a & b & Dx).
  destruct (walks (S i) D x a s b LD P Dx) as (l & E & j & _ & LE & Le & _ & B).
  destruct (B i) as (l1 & F & G & l2 & _ & R1 & Hd & M & R2); [lia|].
  assert (PF := run_possible _ _ _ R1 P). assert (C : crowded Q f F).
  { unfold crowded. assert (Same : residents Q f F = residents Q f D); [|lia].
    clear - R1 P ND St In_. induction R1 as [D|p D E l F M R1 IH]; auto. rewrite IH by (eapply move_possible; eauto).
    eapply residents_stay; eauto. }
  assert (J : jam (fun r => In r Q) G).
  { apply (entering_jams wide Q ND f St In_ (place (far i s)) F G PF C M Out). exists (far i s). split; auto.
    replace (next (far i s)) with (far (S i) s); auto. replace (S i) with (i + 1) by lia. rewrite <- far_far. auto. }
  apply (no_jam E LE). exists (fun r => In r Q). apply (jam_lasts G l2 E); auto.
Qed.
End Necessary.

(* Sufficient. *)
Definition good D := possible D /\ ~ jammed D /\ uncrowded D.

Lemma good_move p D E : good D -> move p D E -> ~ jammed E -> good E.
Proof. intros (P & N & U) M NE. split; [eapply move_possible; eauto|]. split; auto. eapply uncrowded_stays; eauto. Qed.

(* configurations as finite tables *)
Definition of (c : list (list spot)) : config := fun p => nth p c [].
Definition code (D : config) := Push.code places D.
Definition codes := Push.codes places spots.

Lemma of_code D : possible D -> forall p, of (code D) p = D p.
Proof.
  intros P p. unfold of, code, Push.code. destruct (le_lt_dec places p) as [Le|L].
  - rewrite nth_overflow by (rewrite map_length, seq_length; auto). destruct (D p) as [|s l] eqn:Dp; auto. exfalso.
    assert (place s = p) by (apply (P p); rewrite Dp; left; auto). specialize (all_places s). lia.
  - rewrite (nth_indep _ [] (D 0)) by (rewrite map_length, seq_length; auto). rewrite map_nth, seq_nth; auto.
Qed.

Lemma same_jammed (D E : config) : (forall r, D r = E r) -> jammed E -> jammed D.
Proof.
  intros Same (C & Some_ & J). exists C. split; auto. intros r Cr. destruct (J r Cr) as [F (q & (s & Hs & Ws) & Cq)].
  split; [unfold full; rewrite Same; auto|]. exists q. split; auto. exists s. split; auto. unfold head. rewrite Same. auto.
Qed.

Lemma same_move p (D E D' E' : config) : (forall r, D' r = D r) -> (forall r, E' r = E r) -> move p D E -> move p D' E'.
Proof.
  intros SD SE (s & line & A & B & C & F & G). exists s, line. unfold full in *. rewrite !SD, !SE. repeat (split; auto).
  intros r N1 N2. rewrite SE, SD. auto.
Qed.

Lemma same_good (D E : config) : (forall r, E r = D r) -> good D -> good E.
Proof.
  intros Same (P & N & U). split; [intro p; rewrite Same; apply P|]. split.
  - intro J. apply N. apply (same_jammed D E); auto.
  - intros Q f ND St In_ (x & s & I & C). unfold residents.
    rewrite (sum_ext (fun p => count f true (E p)) (fun p => count f true (D p))) by (intros; rewrite Same; auto).
    apply U; auto. exists x, s. rewrite <- Same. auto.
Qed.

Lemma same_serve p (D E E' : config) m : (forall r, E' r = E r) -> serve p D E m -> serve p D E' m.
Proof.
  intros Same S. assert (NJ : forall X, ~ jammed X -> (forall r, E' r = X r) -> ~ jammed E').
  { intros X N Sx J. apply N. apply (same_jammed X E'); auto. }
  destruct S as [z h En M N|z h w G En M J A W Nw F MG N].
  - apply (last_one p D E' z h); eauto. apply (same_move z D E); auto.
  - apply (other_one p D E' z h w G); eauto. apply (same_move w D E); auto.
Qed.

Lemma run_from (D C : config) l E : (forall r, D r = C r) -> l <> [] -> run C l E -> run D l E.
Proof.
  intros Same N Rn. destruct Rn as [|q C B l E M Rn]; [contradiction|]. apply (more q D B l E); auto. apply (same_move q C B); auto.
Qed.

Lemma run_to (D : config) l E C : (forall r, C r = E r) -> l <> [] -> run D l E -> run D l C.
Proof.
  intros Same N Rn. induction Rn as [|q D B l E M Rn IH]; [contradiction|]. destruct l as [|p l].
  - inversion Rn; subst. apply (more q D C []); [|constructor]. apply (same_move q D E); auto.
  - apply (more q D B); auto. apply IH; auto. discriminate.
Qed.

Lemma served D p : good D -> D p <> [] -> exists l E, run D l E /\ good E /\ 0 < times p l.
Proof.
  intros GD NE. assert (code_eq : forall a b : list (list spot), {a = b} + {a <> b}) by (repeat apply list_eq_dec; auto).
  destruct (table code_eq (0, []) (fun c (mc : nat * list (list spot)) => good (of c) -> of c p <> [] ->
    serve p (of c) (of (snd mc)) (fst mc) /\ In (snd mc) codes) codes) as [f Hf].
  { intros c _. destruct (classic (good (of c) /\ of c p <> [])) as [[G N]|No]; [|exists (0, []); tauto].
    assert (G' := G). destruct G' as (P & NJ & _). destruct (service_goes_on wide p (of c) P NJ N) as (E & m & S).
    assert (PE : possible E) by (destruct (serve_target p _ _ _ P S) as (h & _ & _ & M & _); eapply move_possible; eauto).
    exists (m, code E). intros _ _. simpl. split; [apply (same_serve p (of c) E); auto; apply of_code; auto|].
    apply Push.coded; auto. }
  set (c := fix c i := match i with 0 => code D | S j => snd (f (c j)) end).
  set (m := fun i => fst (f (c i))).
  assert (Same : forall r, of (c 0) r = D r) by (apply of_code; apply GD).
  assert (Found : exists l E, run (of (c 0)) l E /\ good E /\ 0 < times p l).
  { apply NNPP. intro No.
    assert (Inv : forall n, In (c n) codes /\ good (of (c n)) /\ of (c n) p <> [] /\ exists l, run (of (c 0)) l (of (c n))).
    { induction n as [|n (I & G & N & l & Rl)].
      - split; [apply Push.coded; auto; apply GD|]. split; [apply (same_good D); auto|]. split; [rewrite Same; auto|].
        exists []. constructor.
      - destruct (Hf (c n) I G N) as [Sv I2]. assert (P : possible (of (c n))) by apply G.
        destruct (serve_target p _ _ _ P Sv) as (h & W & Room & M & NJ & _).
        assert (G2 := good_move _ _ _ G M NJ). assert (R2 : run (of (c 0)) (l ++ [m n]) (of (c (S n)))).
        { eapply run_app; eauto. eapply more; [exact M|constructor]. }
        split; auto. split; auto. split; [|eauto]. intro Empty. apply No.
        destruct (Nat.eq_dec (m n) p) as [Em|Nm].
        + exists (l ++ [m n]), (of (c (S n))). split; auto. split; auto. rewrite times_app, Em. unfold times at 2. simpl.
          destruct (Nat.eq_dec p p); [lia|contradiction].
        + destruct (line_after (m n) _ _ p P M) as [E|[t E]]; auto.
          * exfalso. apply N. rewrite <- E. exact Empty.
          * simpl in Empty. rewrite E in Empty. apply app_eq_nil in Empty. destruct Empty. discriminate. }
    apply (no_endless_service wide places all_places spots all_spots spot_eq closed p (fun i => of (c i)) m).
    - apply (proj1 (proj2 (Inv 0))).
    - intro i. destruct (Inv i) as (I & G & N & _). apply (Hf (c i) I G N).
    - intros i Em. apply No. destruct (Inv i) as (I & G & N & l & Rl). destruct (Hf (c i) I G N) as [Sv _].
      destruct (serve_target p _ _ _ (proj1 G) Sv) as (h & _ & _ & M & NJ & _). exists (l ++ [m i]), (of (c (S i))).
      split; [eapply run_app; eauto; eapply more; [exact M|constructor]|]. split; [eapply good_move; eauto|].
      rewrite times_app, Em. unfold times at 2. simpl. destruct (Nat.eq_dec p p); [lia|contradiction]. }
  destruct Found as (l & E & Rn & G & T). exists l, E. split; auto. apply (run_from _ (of (c 0))); auto.
  intros ->. unfold times in T. simpl in T. lia.
Qed.

Lemma served_in_line n : forall D p, good D -> n < length (D p) -> exists l E, run D l E /\ good E /\ n < times p l.
Proof.
  induction n as [n IH] using lt_wf_ind. intros D p G L.
  destruct (served D p G) as (l & E & Rn & GE & T); [destruct (D p); [simpl in L; lia|discriminate]|].
  destruct (le_lt_dec (times p l) n) as [Le|Lt]; [|exists l, E; auto].
  destruct (first_out D l E p Rn) as [new Ep]; [apply G|lia|].
  destruct (IH (n - times p l)) with (D := E) (p := p) as (m & F & Rm & GF & Tm); auto; [lia|rewrite Ep, app_length, skipn_length; lia|].
  exists (l ++ m), F. split; [eapply run_app; eauto|]. split; auto. rewrite times_app. lia.
Qed.

Lemma good_keeps : keeps good.
Proof.
  intros D p a s b G Dp. apply served_in_line; auto. rewrite Dp, app_length. simpl. lia.
Qed.

Theorem live_for_everyone D : possible D -> (live D <-> ~ circle D /\ uncrowded D).
Proof.
  intro P. split.
  - intros (L & K & LD). split; [intro C; apply (no_jam L K D LD); apply circle_jams; auto|apply (no_crowd L K); auto].
  - intros [N U]. exists good. split; [apply good_keeps|]. split; auto. split; auto. intro J. apply N.
    apply (jam_has_circle D places); auto. intro p. specialize (wide p). lia.
Qed.

(* a round: every vehicle moves in it *)
Definition round (D : config) l E := run D l E /\ forall p, length (D p) <= times p l.
(* and one round after another without end *)
Definition for_ever (D : config) := exists X l, X 0 = D /\ forall i : nat, round (X i) (l i) (X (S i)).

Lemma all_served D : good D -> exists l E, round D l E /\ good E.
Proof.
  intro G. assert (H : forall ps, exists l E, run D l E /\ good E /\ forall p, In p ps -> length (D p) <= times p l).
  { induction ps as [|a ps (l & E & Rn & GE & All)]; [exists [], D; split; [constructor|split; auto; intros p []]|].
    destruct (le_lt_dec (length (D a)) (times a l)) as [Le|Lt].
    - exists l, E. split; auto. split; auto. intros p [<-|I]; auto.
    - destruct (first_out D l E a Rn) as [new Ea]; [apply G|lia|].
      destruct (served_in_line (length (D a) - times a l - 1) E a GE) as (m & F & Rm & GF & T).
      { rewrite Ea, app_length, skipn_length. lia. }
      exists (l ++ m), F. split; [eapply run_app; eauto|]. split; auto. intros p [<-|I]; rewrite times_app; [lia|].
      specialize (All p I). lia. }
  destruct (H (seq 0 places)) as (l & E & Rn & GE & All). exists l, E. split; [split; auto|auto]. intro p.
  destruct (D p) as [|s line] eqn:Dp; [simpl; lia|]. rewrite <- Dp. apply All. apply in_seq.
  assert (place s = p) by (apply (proj1 G p); rewrite Dp; left; auto). pose proof (all_places s). lia.
Qed.

Theorem live_is_for_ever D : possible D -> (live D <-> for_ever D).
Proof.
  intro P. split.
  - intro Lv. assert (G : good D).
    { apply (live_for_everyone D P) in Lv. destruct Lv as [N U]. split; auto. split; auto. intro J. apply N.
      apply (jam_has_circle D places); auto. intro p. pose proof (wide p). lia. }
    destruct (classic (exists p, D p <> [])) as [[p0 N0]|Empty].
    2:{ exists (fun _ => D), (fun _ => []). split; auto. intros _. split; [constructor|]. intro p.
        destruct (D p) eqn:Dp; [auto|]. exfalso. apply Empty. exists p. congruence. }
    assert (code_eq : forall a b : list (list spot), {a = b} + {a <> b}) by (repeat apply list_eq_dec; auto).
    set (busy := fun E : config => good E /\ exists p, E p <> []).
    destruct (table code_eq ([], []) (fun c (lc : list nat * list (list spot)) => busy (of c) ->
      round (of c) (fst lc) (of (snd lc)) /\ In (snd lc) codes /\ busy (of (snd lc))) codes) as [f Hf].
    { intros c _. destruct (classic (busy (of c))) as [[Gc (p & Np)]|No]; [|exists ([], []); tauto].
      destruct (all_served (of c) Gc) as (l & E & [Rn All] & GE). exists (l, code E). intros _. simpl.
      assert (Same := of_code E (proj1 GE)). assert (T := All p). assert (Long : 0 < length (of c p)) by (destruct (of c p); [contradiction|simpl; lia]).
      assert (Nl : l <> []) by (intros ->; unfold times in T; simpl in T; lia).
      split; [split; auto; apply (run_to _ l E); auto|]. split; [apply Push.coded; auto; apply GE|].
      split; [apply (same_good E); auto|]. clear - Rn Nl Same Gc. apply NNPP. intro Em.
      assert (Z : forall r, E r = []) by (intro r; apply NNPP; intro Nr; apply Em; exists r; rewrite Same; auto).
      clear Em Same. destruct Gc as [P _]. induction Rn as [|q C B l E M Rn IH]; [contradiction|]. destruct l as [|r l].
      - inversion Rn; subst. destruct M as (s & line & _ & _ & _ & Et & _). rewrite Z in Et. exact (app_cons_not_nil _ _ _ Et).
      - apply IH; auto; try discriminate; eapply move_possible; eauto. }
    set (c := fix c i := match i with 0 => code D | S j => snd (f (c j)) end).
    assert (Same : forall r, of (c 0) r = D r) by (apply of_code; auto).
    assert (Inv : forall i, In (c i) codes /\ busy (of (c i))).
    { induction i as [|i [I Bi]]; [|simpl; apply (Hf (c i) I Bi)]. split; [apply Push.coded; auto|].
      split; [apply (same_good D); auto|]. exists p0. rewrite Same. auto. }
    exists (fun i => match i with 0 => D | _ => of (c i) end), (fun i => fst (f (c i))). split; auto.
    intro i. destruct (Inv i) as [I Bi]. destruct (Hf (c i) I Bi) as [[Rn All] _]. destruct i as [|i]; [|split; auto]. split.
    + apply (run_from D (of (c 0))); auto. intro Nl. specialize (All p0). rewrite Nl, Same in All. unfold times in All. simpl in All.
      destruct (D p0); [contradiction|simpl in All; lia].
    + intro p. rewrite <- Same. auto.
  - intros (X & l & X0 & Rounds). exists (fun E => exists i, E = X i). split; [|eauto].
    intros E p a s b [i ->] Ep. destruct (Rounds i) as [Rn All]. exists (l i), (X (S i)). split; auto. split; [eauto|].
    specialize (All p). rewrite Ep, app_length in All. simpl in All. lia.
Qed.

(* so where (S) holds the rule that never closes a circle lets everyone go on and refuses nothing that is safe *)
Theorem chain_rule_is_exact p D E : possible D -> live D -> move p D E -> (live E <-> ~ circle E).
Proof.
  intros P Lv M. assert (PE := move_possible p D E P M). rewrite (live_for_everyone E PE). split; [tauto|].
  intro N. split; auto. apply (live_for_everyone D P) in Lv. apply (uncrowded_stays p D E P); tauto.
Qed.
End Everyone.
Print Assumptions its_turn.
Print Assumptions first_out.
Print Assumptions circle_jams.
Print Assumptions jam_has_circle.
Print Assumptions live_for_everyone.
Print Assumptions live_is_for_ever.
Print Assumptions chain_rule_is_exact.
